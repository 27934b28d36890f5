"""Small sample scans, and what made them."""
