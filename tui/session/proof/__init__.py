"""The proof of communication loss: does a drive react to a silent line as it is set to?"""
