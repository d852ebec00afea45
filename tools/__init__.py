"""What the project makes of itself: pages and pictures of the documentation."""
