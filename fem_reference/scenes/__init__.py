"""Cases as frozen records, and how their files are read."""
