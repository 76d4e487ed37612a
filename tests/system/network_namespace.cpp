#include "tests/system/network_namespace.h"

#include <cerrno>
#include <cstring>
#include <sched.h>
#include <string>
#include <unistd.h>

#include <arpa/inet.h>
#include <net/if.h>
#include <net/route.h>
#include <netinet/in.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

namespace posed {

namespace {

Status error_of(const char* what) {
  return make_error(ErrorCode::Unavailable, std::string(what) + ": " + std::strerror(errno));
}

/// `ip link set lo up; ip link set lo multicast on; ip route add 224.0.0.0/4 dev lo`.
bool bring_loopback_up(int fd) {
  char device[] = "lo";
  ifreq request{};
  std::memcpy(request.ifr_name, device, sizeof(device));
  request.ifr_flags = IFF_UP | IFF_RUNNING | IFF_MULTICAST;
  if (ioctl(fd, SIOCSIFFLAGS, &request) != 0) {
    return false;
  }
  const auto address = [](const char* text) {
    sockaddr_in internet{};
    internet.sin_family = AF_INET;
    inet_pton(AF_INET, text, &internet.sin_addr);
    sockaddr generic{};
    static_assert(sizeof(generic) == sizeof(internet));
    std::memcpy(&generic, &internet, sizeof(generic));
    return generic;
  };
  rtentry route{};
  route.rt_dst = address("224.0.0.0");
  route.rt_genmask = address("240.0.0.0");
  route.rt_flags = RTF_UP;
  route.rt_dev = device;
  return ioctl(fd, SIOCADDRT, &route) == 0;
}

}  // namespace

Status enter_multicast_namespace() {
  if (unshare(CLONE_NEWNET) != 0 && unshare(CLONE_NEWUSER | CLONE_NEWNET) != 0) {
    return error_of("a network namespace cannot be made");
  }
  const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (fd < 0) {
    return error_of("a socket cannot be made in the new network namespace");
  }
  const Status status = bring_loopback_up(fd) ? Status{} : error_of("multicast cannot be set up on lo");
  close(fd);
  return status;
}

}  // namespace posed
