"""Robots: joints, links, limits and data sheets, from URDF or Denavit-Hartenberg tables."""
