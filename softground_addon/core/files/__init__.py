"""Files: the report, point caches, and the only way to write one."""
