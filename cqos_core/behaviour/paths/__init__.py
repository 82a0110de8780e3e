"""What arrives over several hops: the paths of samples over bridges, the age of data over chains, the load of links."""
