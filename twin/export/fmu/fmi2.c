/* The functions of FMI 2.0 for co-simulation, declared after the standard's text. */

#include "instance.h"

/* Source code linked statically has the model's name before each function. */
#if defined(FMI2_FUNCTION_PREFIX)
#define DT_PASTE(a, b) a##b
#define DT_PASTED(a, b) DT_PASTE(a, b)
#define FMI2(name) DT_PASTED(FMI2_FUNCTION_PREFIX, name)
#else
#define FMI2(name) name
#endif

typedef void (*Logger)(void *environment, const char *instance, int status, const char *category, const char *text, ...);

typedef struct {
    Logger logger;
    void *(*allocate)(size_t, size_t);
    void (*free)(void *);
    void (*step_finished)(void *, int);
    void *environment;
} Callbacks;

typedef unsigned int Reference;

static void write_log(DtInstance *instance, const char *message)
{
    Logger logger = (Logger)instance->logger;
    if (logger) logger(instance->environment, instance->name, DT_ERROR, "logStatusError", message);
}

static int unknown(void *c)
{
    return dt_error(c, "The model has no variables of this type, and does not know this function.");
}

DT_EXPORT const char *FMI2(fmi2GetTypesPlatform)(void) { return "default"; }

DT_EXPORT const char *FMI2(fmi2GetVersion)(void) { return "2.0"; }

DT_EXPORT void *FMI2(fmi2Instantiate)(const char *name, int type, const char *guid, const char *resources,
                                      const Callbacks *callbacks, int visible, int logging)
{
    (void)resources;
    (void)visible;
    (void)logging;
    DtInstance *instance = dt_new(name);
    if (!instance) return NULL;
    if (callbacks) {
        instance->logger = (void (*)(void))callbacks->logger;
        instance->environment = callbacks->environment;
    }
    instance->log = write_log;
    if (type != 1 || !guid || strcmp(guid, MODEL_TOKEN) != 0) {
        dt_error(instance, type != 1 ? "The model is for co-simulation only."
                                     : "The GUID is not that of modelDescription.xml: library and description differ.");
        dt_free(instance);
        return NULL;
    }
    return instance;
}

DT_EXPORT void FMI2(fmi2FreeInstance)(void *c) { dt_free(c); }

DT_EXPORT int FMI2(fmi2SetDebugLogging)(void *c, int on, size_t count, const char *const categories[])
{
    (void)c, (void)on, (void)count, (void)categories;
    return DT_OK;
}

DT_EXPORT int FMI2(fmi2SetupExperiment)(void *c, int tolerance_defined, double tolerance, double start, int stop_defined,
                                        double stop)
{
    (void)tolerance_defined, (void)tolerance, (void)stop_defined, (void)stop;
    return dt_setup(c, start);
}

DT_EXPORT int FMI2(fmi2EnterInitializationMode)(void *c) { return dt_enter_initialisation(c); }

DT_EXPORT int FMI2(fmi2ExitInitializationMode)(void *c) { return dt_exit_initialisation(c); }

DT_EXPORT int FMI2(fmi2Terminate)(void *c) { return dt_terminate(c); }

DT_EXPORT int FMI2(fmi2Reset)(void *c)
{
    dt_reset(c);
    return DT_OK;
}

DT_EXPORT int FMI2(fmi2GetReal)(void *c, const Reference r[], size_t n, double v[]) { return dt_get(c, r, n, v); }

DT_EXPORT int FMI2(fmi2SetReal)(void *c, const Reference r[], size_t n, const double v[]) { return dt_set(c, r, n, v); }

/* There are no variables of other types; none of them may be asked for. */
#define OTHER_TYPE(get, set, type)                                                                                    \
    DT_EXPORT int FMI2(get)(void *c, const Reference r[], size_t n, type v[])                                         \
    {                                                                                                                 \
        (void)r, (void)v;                                                                                             \
        return n ? unknown(c) : DT_OK;                                                                                \
    }                                                                                                                 \
    DT_EXPORT int FMI2(set)(void *c, const Reference r[], size_t n, const type v[])                                   \
    {                                                                                                                 \
        (void)r, (void)v;                                                                                             \
        return n ? unknown(c) : DT_OK;                                                                                \
    }

typedef const char *Text;
OTHER_TYPE(fmi2GetInteger, fmi2SetInteger, int)
OTHER_TYPE(fmi2GetBoolean, fmi2SetBoolean, int)
OTHER_TYPE(fmi2GetString, fmi2SetString, Text)

DT_EXPORT int FMI2(fmi2GetFMUstate)(void *c, void **state) { return dt_get_state(c, state); }

DT_EXPORT int FMI2(fmi2SetFMUstate)(void *c, void *state) { return dt_set_state(c, state); }

DT_EXPORT int FMI2(fmi2FreeFMUstate)(void *c, void **state)
{
    (void)c;
    return dt_free_state(state);
}

DT_EXPORT int FMI2(fmi2SerializedFMUstateSize)(void *c, void *state, size_t *size)
{
    (void)c, (void)state;
    *size = sizeof(DtSerialised);
    return DT_OK;
}

DT_EXPORT int FMI2(fmi2SerializeFMUstate)(void *c, void *state, char bytes[], size_t size)
{
    return dt_serialise(c, state, bytes, size);
}

DT_EXPORT int FMI2(fmi2DeSerializeFMUstate)(void *c, const char bytes[], size_t size, void **state)
{
    return dt_deserialise(c, bytes, size, state);
}

DT_EXPORT int FMI2(fmi2GetDirectionalDerivative)(void *c, const Reference unknowns[], size_t n, const Reference knowns[],
                                                 size_t m, const double seed[], double result[])
{
    (void)unknowns, (void)n, (void)knowns, (void)m, (void)seed, (void)result;
    return unknown(c);
}

DT_EXPORT int FMI2(fmi2SetRealInputDerivatives)(void *c, const Reference r[], size_t n, const int order[],
                                                const double v[])
{
    (void)r, (void)order, (void)v;
    return n ? unknown(c) : DT_OK;
}

DT_EXPORT int FMI2(fmi2GetRealOutputDerivatives)(void *c, const Reference r[], size_t n, const int order[], double v[])
{
    (void)r, (void)order, (void)v;
    return n ? unknown(c) : DT_OK;
}

DT_EXPORT int FMI2(fmi2DoStep)(void *c, double time, double length, int no_set_state)
{
    (void)no_set_state;
    return dt_step(c, time, length);
}

DT_EXPORT int FMI2(fmi2CancelStep)(void *c) { return unknown(c); }

/* Steps are never pending: there is nothing to ask for but the time reached. */
DT_EXPORT int FMI2(fmi2GetStatus)(void *c, int kind, int *value)
{
    (void)kind, (void)value;
    return unknown(c);
}

DT_EXPORT int FMI2(fmi2GetRealStatus)(void *c, int kind, double *value)
{
    if (kind != 2) return unknown(c);
    *value = dt_time(&((DtInstance *)c)->memory);
    return DT_OK;
}

DT_EXPORT int FMI2(fmi2GetIntegerStatus)(void *c, int kind, int *value)
{
    (void)kind, (void)value;
    return unknown(c);
}

DT_EXPORT int FMI2(fmi2GetBooleanStatus)(void *c, int kind, int *value)
{
    if (kind != 3) return unknown(c);
    *value = 0;
    return DT_OK;
}

DT_EXPORT int FMI2(fmi2GetStringStatus)(void *c, int kind, Text *value)
{
    (void)kind, (void)value;
    return unknown(c);
}
