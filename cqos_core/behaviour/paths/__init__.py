"""Data over several hops: paths of samples over bridges, age of data in chains, load of links."""
