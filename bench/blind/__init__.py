"""The blind benchmark: cases made by the plant, scored by what a diagnosis says of them."""
