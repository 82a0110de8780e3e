"""The rules of packs as columns: conditions for engines of tables, and the check of a whole fleet with them."""
