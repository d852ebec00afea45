"""A recorded flight as a film."""
