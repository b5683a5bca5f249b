"""Characters: recognised from rigs and objects, read as motions with soles."""
