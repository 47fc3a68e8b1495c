"""Opening of lines, and identification of the drives on them."""
