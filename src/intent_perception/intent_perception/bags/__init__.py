"""RGB-D frames out of recorded bags and sensor messages, and into them."""
