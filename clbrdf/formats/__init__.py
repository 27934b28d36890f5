"""Files that others write, read into scans: one format a file."""
