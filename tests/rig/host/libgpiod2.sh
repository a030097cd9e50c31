# SPDX-License-Identifier: Apache-2.0
# The sources of libgpiod 2, which Debian 12 has not: its Python binding on PyPI carries them. Sourced by run.

# Leaves their directory in $libgpiod2, or nothing there when they cannot be had; then the case gpiod2 is
# skipped.
prepare_libgpiod2() {
  local cache=$rig_cache/libgpiod2
  mkdir -p "$cache"
  libgpiod2=$(find "$cache" -maxdepth 1 -type d -name 'gpiod-2.*' | head -n 1)
  [ -z "$libgpiod2" ] || return 0
  if python3 -m pip download -q --no-deps --no-binary gpiod -d "$cache" gpiod==2.3.0 \
    > "$cache/download.log" 2>&1; then
    tar -xf "$(find "$cache" -name 'gpiod-2.*.tar.gz' | head -n 1)" -C "$cache"
    libgpiod2=$(find "$cache" -maxdepth 1 -type d -name 'gpiod-2.*' | head -n 1)
  fi
}
