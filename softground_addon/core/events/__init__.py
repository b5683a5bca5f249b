"""Events of feet, as files and as sound, to cut by and to hear."""
