"""``cqos prove``: pairs run on real middleware, and what happens is compared with what C-QoS says of them."""
