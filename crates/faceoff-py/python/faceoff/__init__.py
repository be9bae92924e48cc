"""Develop, train and evaluate agents for the robot air hockey competition."""
