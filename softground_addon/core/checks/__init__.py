"""What is wrong with a bake, or may be: judged by what did not make it."""
