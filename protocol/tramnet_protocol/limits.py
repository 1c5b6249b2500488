"""The numbers every node agrees on: sizes, times and counts that bound what the network may cost."""

MAX_MESSAGE_BYTES = 4 * 1024 * 1024
"""Largest payload of one message [B]; the sender refuses more, and so does the receiver."""

MAX_STRUCTURE_BYTES = 256 * 1024
"""Largest part of a payload outside its binary strings [B].

A byte of MessagePack can become a Python object of 72 bytes (an empty map in a list), so bulk travels in
binary strings only, and decoding a hostile payload costs at most some 50 MiB.
"""

MAX_ITEMS = 4096
"""Largest number of entries of one list or map."""

CREDIT_BYTES = 256 * 1024
"""Unacknowledged bytes allowed on one directed link [B]."""

MAX_SEATS = 4095
"""Seats are 0 to ``MAX_SEATS - 1``; the last number of the wire's range means nobody in particular."""

LEASE_SECONDS = 5.0
"""Silence after which a transport counts as lost [s]; longer than any receiver is ever busy."""

WAIT_BEFORE_CLOSE_SECONDS = 1.0
"""Longest wait of a publisher for a link that accepts nothing, which is then closed [s]."""
