# shellcheck shell=bash disable=SC2034  # read by the scripts that source this file
# What the virtual machine's image is made of. A change here, or in build_image and what it copies, makes a new image.

vm_suite=bookworm
vm_disk_size=900M

# Debian packages in the guest, beside those of the libraries that posed and posectl link.
vm_guest_packages=(
  systemd systemd-sysv udev kmod
  iproute2 procps
  v4l-utils                      # v4l2-ctl, the independent word on what a camera does
  gpiod                          # gpioset and gpioget, the same for lines
  libcamera-tools libcamera-ipa  # cam, and what the simulated camera's pipeline needs
  libjpeg-turbo-progs            # cjpeg, for a camera with JPEG images
  netpbm                         # reads recorded images independently
)

# Modules of Debian's kernel package, and what they depend on: devices made of software.
vm_kernel_modules=(virtio_pci virtio_blk virtio_rng ext4 9p 9pnet_virtio configfs vivid)

# Modules that Debian builds no package of, compiled from Debian's sources.
vm_built_modules=(gpio-sim vimc v4l2loopback)
