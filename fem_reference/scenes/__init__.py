"""Cases as frozen records, and functions that read them from files."""
