"""A Debian with a newer Rust and its library for browsers, where the machine's own Rust lacks either. It needs root."""
import os
import pathlib
import subprocess

ROOT = pathlib.Path(__file__).resolve().parent.parent
SYSTEM = pathlib.Path(os.environ.get("FIELDLOD_NEWER_RUST", "/var/cache/fieldlod-newer-rust"))


def install_system(packages=""):
    """Installs the system, and in it Rust, a linker and other packages."""
    if not (SYSTEM / "etc/debian_version").exists():
        subprocess.run(["debootstrap", "--variant=minbase", "trixie", SYSTEM], check=True, stdout=subprocess.DEVNULL)
    source = "deb http://deb.debian.org/debian trixie-backports main\n"
    (SYSTEM / "etc/apt/sources.list.d/backports.list").write_text(source)
    packages = f"rustc cargo libstd-rust-dev-wasm32 gcc libc6-dev lld {packages}"
    install = "apt-get install -y -qq --no-install-recommends -t trixie-backports"
    # Rust looks for its own linker, which is a copy of this one.
    in_system(f"dpkg -s {packages} >/dev/null 2>&1 || (apt-get update -qq && {install} {packages}) "
              "&& ln -sf lld /usr/bin/rust-lld")


def in_system(command):
    """Runs a shell command in the system. Its mounts end with it."""
    registry = pathlib.Path(os.environ.get("CARGO_HOME", pathlib.Path.home() / ".cargo")) / "registry"
    mounts = ["mount -t proc proc $0/proc", "mount --rbind /dev $0/dev"]
    for folder, at in [(ROOT, ROOT), (registry, "/root/.cargo/registry")]:
        mounts.append(f"mkdir -p $0{at} && mount --bind {folder} $0{at}")
    enter = f"exec chroot $0 /usr/bin/env -i HOME=/root PATH=/usr/bin:/usr/sbin:/bin sh -c 'cd {ROOT} && {command}'"
    subprocess.run(["unshare", "--mount", "bash", "-ec", "\n".join([*mounts, enter]), SYSTEM], check=True)
