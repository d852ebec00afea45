"""What a vehicle can fly for ever without more room, and the beginnings that lead to it."""
