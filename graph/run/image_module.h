/* Finding and loading the OpenImageIO module. Internal to graph/run/image_*.c. */
#ifndef RL_RUN_IMAGE_MODULE_H
#define RL_RUN_IMAGE_MODULE_H

#include "graph/base/error.h"
#include "graph/run/shim_oiio.h"

/* NULL with an error when it cannot be loaded; the first result, good or bad, is kept. Thread-safe. */
const rl_oiio_module *rl_image_module(rl_error *err);

#endif
