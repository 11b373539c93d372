"""The demonstrator in front of a camera: room, light, frames with truth."""
