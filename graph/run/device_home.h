/* Where OpenCL implementations keep what they compile. */
#ifndef RL_RUN_DEVICE_HOME_H
#define RL_RUN_DEVICE_HOME_H

#ifdef __cplusplus
extern "C" {
#endif

/* Before the first call of OpenCL. PoCL offers no device at all where it cannot make its folder, below
 * $XDG_CACHE_HOME or $HOME: a service or a container whose user has no home. It gets one in the folder for
 * temporary files then, by $POCL_CACHE_DIR, unless that is set. Changes the environment: not thread-safe, as
 * setenv. */
void rl_device_home(void);

#ifdef __cplusplus
}
#endif
#endif
