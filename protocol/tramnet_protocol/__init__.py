"""What is said on the network, and to whom: messages, frames, keys, topologies and transports."""
