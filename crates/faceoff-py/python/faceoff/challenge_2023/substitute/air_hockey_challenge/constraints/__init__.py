from .constraints import *
