"""Data that the rooms exchange: systems, reports, problems, codes, places and texts; nothing here decides."""
