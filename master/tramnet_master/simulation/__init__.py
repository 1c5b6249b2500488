"""A network and a farm in virtual time: what the link books and ``tramnet simulate`` are computed with."""
