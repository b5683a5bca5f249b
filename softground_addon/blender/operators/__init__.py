"""The operators behind the buttons, most of them jobs with a bar and Esc."""
