"""Cases as frozen records, and the reading of their files."""
