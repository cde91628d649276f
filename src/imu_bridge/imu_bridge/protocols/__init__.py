"""How IMUs talk: one small file a protocol, all of them pure."""
