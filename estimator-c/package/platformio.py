"""Links the library for the board's processor."""

from pathlib import Path

Import("env")  # noqa: F821: defined by PlatformIO

board = env.BoardConfig()  # noqa: F821
processor = board.get("build.cpu", board.get("build.mcu"))
flags = env.get("CCFLAGS", [])  # noqa: F821
abi = next((flag.removeprefix("-mfloat-abi=") for flag in flags if flag.startswith("-mfloat-abi=")), None)
source = Path(env.Dir(".").srcnode().abspath, "src", processor)  # noqa: F821
folders = [source] if abi in (None, "soft") else sorted(source.glob(f"*-{abi}"))
if not folders or not (folders[0] / "libfootfall_estimator.a").is_file():
    raise SystemExit(f"footfall: there is no library for {processor} with the calling convention {abi}")
env.Append(LIBPATH=[str(folders[0])], LIBS=["footfall_estimator"])  # noqa: F821
