"""What a diagnosis says, as typed parts, and their JSON."""
