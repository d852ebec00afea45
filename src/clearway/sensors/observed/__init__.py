"""Space that was observed to be free: voxels of the world that beams crossed."""
