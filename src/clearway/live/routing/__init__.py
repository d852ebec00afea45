"""Ways round what is known: distance fields, route maps, and the search in them."""
