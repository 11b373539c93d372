"""What a frame says: its tile, colours, labels per pixel, and the evidence gathered from them."""
