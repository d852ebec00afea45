"""Ways round what is known: distance fields, and cells that time marches over."""
