"""Motion capture as laboratories record it: markers, joint centres, force plates."""
