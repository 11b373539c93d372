"""Transforms, cameras, meshes and the images that meshes leave: no object is known here."""
