"""What arrives over several hops: the paths of samples over bridges, and what bridges do to a system."""
