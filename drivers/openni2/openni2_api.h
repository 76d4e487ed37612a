#pragma once

#include <OpenNI.h>
#include <initializer_list>  // which OpenNI.h forgets
