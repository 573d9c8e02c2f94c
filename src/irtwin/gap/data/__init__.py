"""What is diagnosed: the case, whether it can be, its noise floor, whether its runs are of one robot."""
