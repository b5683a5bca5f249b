"""Files: the report, batches, receipts, point caches, and the only way to write one."""
