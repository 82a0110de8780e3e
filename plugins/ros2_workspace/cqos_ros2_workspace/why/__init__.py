"""Why nothing arrives on a topic: one list of causes, each excluded, found or not known."""
