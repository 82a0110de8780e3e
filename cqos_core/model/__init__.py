"""Systems, reports and their parts: what the rooms exchange, with problems, codes, places and texts; nothing here decides."""
