"""The closed-loop benchmark: arms that others modelled, in MuJoCo with its own friction, labelled like blind cases."""
