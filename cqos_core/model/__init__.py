"""Systems, reports and their parts: what the other sub-packages exchange, with problems, codes, places and texts; nothing here decides."""
