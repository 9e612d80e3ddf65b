"""What a file is instead of what was expected, by its first bytes: a failed download, a pointer, an archive."""

#: First bytes, what they are of, and the remedy.
_PACKED = (
    (b"\x1f\x8b", "a gzip archive"),
    (b"BZh", "a bzip2 archive"),
    (b"\xfd7zXZ\0", "an xz archive"),
    (b"\x28\xb5\x2f\xfd", "a Zstandard archive"),
    (b"7z\xbc\xaf\x27\x1c", "a 7z archive"),
    (b"Rar!\x1a\x07", "a RAR archive"),
)
_MODELS = ((b"Kaydara FBX Binary", "an FBX file"), (b"glTF", "a glTF file"), (b"BLENDER", "a Blender file"))


def never_right(head: bytes) -> str:
    """Why a file with these first bytes is not what any reader of this package expects; empty if it may be.

    Returns:
        The rest of a sentence that begins with the file's path.
    """
    text = head.removeprefix(b"\xef\xbb\xbf").lstrip()
    if text.startswith(b"version https://git-lfs"):
        return "is a Git LFS pointer, not the file itself; run 'git lfs pull', or download the file."
    if text[:9].lower() == b"<!doctype" or text[:5].lower() == b"<html":
        return "is a web page: the download failed, or needs a login; download the file again."
    for start, kind in _PACKED:
        if head.startswith(start):
            return f"is {kind}; unpack it and name the file in it."
    return ""


def never_text(head: bytes) -> str:
    """The same of a file that should be text: a ZIP archive, or a 3D model of another format."""
    if head.startswith(b"PK\x03\x04"):
        return "is a ZIP archive; unpack it and name the file in it."
    for start, kind in _MODELS:
        if head.startswith(start):
            return f"is {kind}; export the motion as BVH."
    return ""
