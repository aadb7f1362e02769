"""MEETPOINT -> FOREST -> VOTE -> TURN: which places of the atlas are still possible?"""
