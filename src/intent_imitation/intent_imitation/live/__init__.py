"""What the system believes at this moment, over the camera's picture and on a web page."""
