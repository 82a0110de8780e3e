"""What writes systems down in other forms: our own YAML form here, others in the plugins."""
