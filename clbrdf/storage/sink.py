"""Where HDF5 writes to: a file that never fails it.

HDF5 crashes when it cannot write what it holds back, when a file is closed or later. So it is told that every
write went well; the first that did not is kept, and raised by `check` and `close`.
"""

from __future__ import annotations

import os
from pathlib import Path


class Sink:
    """A new file, as h5py takes one.

    Attributes
    ----------
    error : OSError or None
        The first write that failed.

    Raises
    ------
    OSError
        It cannot be created.
    """

    def __init__(self, path: Path) -> None:
        self.error: OSError | None = None
        self._handle = os.open(path, os.O_RDWR | os.O_CREAT | os.O_EXCL, 0o666)
        self._place = 0

    def check(self) -> None:
        """Raise the first error in writing, if there was one."""
        if self.error is not None:
            raise self.error

    def close(self) -> None:
        """Close the file; HDF5 has to have let go of it."""
        os.close(self._handle)

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        """Go to a place; from the end where `whence` is 2."""
        start = {os.SEEK_SET: 0, os.SEEK_CUR: self._place, os.SEEK_END: os.fstat(self._handle).st_size}
        self._place = start[whence] + offset
        return self._place

    def tell(self) -> int:
        """Return the place."""
        return self._place

    def read(self, size: int = -1) -> bytes:
        """Return what stands at the place: h5py knows a file by this."""
        data = os.pread(self._handle, size, self._place) if size >= 0 else b""
        self._place += len(data)
        return data

    def readinto(self, room: memoryview) -> int:
        """Read; what was never written is zeros."""
        view = memoryview(room).cast("B")
        found = os.preadv(self._handle, [view], self._place)
        view[found:] = bytes(len(view) - found)
        self._place += len(view)
        return len(view)

    def write(self, data: memoryview) -> int:
        """Write all of it, or keep the error."""
        view = memoryview(data).cast("B")
        size, done = len(view), 0
        try:
            while done < size and self.error is None:
                done += os.pwrite(self._handle, view[done:], self._place + done)
        except OSError as error:
            self.error = error
        self._place += size
        return size

    def truncate(self, size: int | None = None) -> int:
        """Cut or lengthen the file."""
        end = self._place if size is None else size
        try:
            os.ftruncate(self._handle, end)
        except OSError as error:
            self.error = self.error or error
        return end

    def flush(self) -> None:
        """Do nothing: every write has gone to the system."""
