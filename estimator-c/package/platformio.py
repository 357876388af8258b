"""Links the library for the board's processor. On an Xtensa, PlatformIO compiles the file of C."""

import platform
from pathlib import Path

Import("env")  # noqa: F821: defined by PlatformIO

# Folders of PCs, by the name of the system and of the machine.
PCS = {
    ("Linux", "x86_64"): "x86_64",
    ("Linux", "aarch64"): "aarch64",
    ("Darwin", "arm64"): "macos/arm64",
    ("Darwin", "x86_64"): "macos/x86_64",
    ("Windows", "AMD64"): "windows/x86_64",
}

# Chips with an Xtensa, by `build.mcu`.
XTENSA = ("esp32", "esp32s2", "esp32s3", "esp8266")


def words(flags):
    """Flags as words: PlatformIO has strings, tuples of an option and its value, and lists of these."""
    if isinstance(flags, (str, Path)):
        return str(flags).split()
    return [word for flag in flags for word in words(flag)]


def value(flags, option):
    """Value of an option, or None."""
    return next((flag.removeprefix(option) for flag in reversed(flags) if flag.startswith(option)), None)


def folder(env):
    """Folder of the library in src."""
    if not env.get("BOARD"):
        machine = (platform.system(), platform.machine())
        return PCS.get(machine, "-".join(machine))
    board = env.BoardConfig()
    processor = board.get("build.cpu", "") or board.get("build.mcu", "")
    flags = words(env.get("CCFLAGS", []))
    abi = value(flags, "-mfloat-abi=")
    if abi in (None, "soft"):
        return processor
    fpu = value(flags, "-mfpu=")
    return f"{processor}/{abi}" if fpu in (None, "auto") else f"{processor}/{fpu}-{abi}"


source = Path(env.Dir(".").srcnode().abspath, "src")  # noqa: F821
processor = folder(env)  # noqa: F821
library = source / processor
if processor in XTENSA:
    env.Append(CPPDEFINES=["FOOTFALL_GENERIC"], CCFLAGS=["-ffp-contract=off"])  # noqa: F821
elif (library / "libfootfall_estimator.a").is_file():
    env.Append(LIBPATH=[str(library)], LIBS=["footfall_estimator"])  # noqa: F821
else:
    raise SystemExit(f"footfall: there is no library {library}")
