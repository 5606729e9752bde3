/* The functions of FMI 3.0 for co-simulation, declared after the standard's text. */

#include "instance.h"

/* Source code linked statically has the model's name before each function. */
#if defined(FMI3_FUNCTION_PREFIX)
#define DT_PASTE(a, b) a##b
#define DT_PASTED(a, b) DT_PASTE(a, b)
#define FMI3(name) DT_PASTED(FMI3_FUNCTION_PREFIX, name)
#else
#define FMI3(name) name
#endif

typedef uint32_t Reference;
typedef const char *Text;
typedef const uint8_t *Binary;
typedef void (*LogMessage)(void *environment, int status, const char *category, const char *text);

static void write_log(DtInstance *instance, const char *message)
{
    LogMessage logger = (LogMessage)instance->logger;
    if (logger) logger(instance->environment, DT_ERROR, "logStatusError", message);
}

static int unknown(void *c)
{
    return dt_error(c, "The model has no variables of this type, and does not know this function.");
}

DT_EXPORT const char *FMI3(fmi3GetVersion)(void) { return "3.0"; }

DT_EXPORT int FMI3(fmi3SetDebugLogging)(void *c, bool on, size_t count, const char *const categories[])
{
    (void)c, (void)on, (void)count, (void)categories;
    return DT_OK;
}

DT_EXPORT void *FMI3(fmi3InstantiateModelExchange)(Text name, Text token, Text resources, bool visible, bool logging,
                                                   void *environment, LogMessage log)
{
    (void)name, (void)token, (void)resources, (void)visible, (void)logging;
    if (log) log(environment, DT_ERROR, "logStatusError", "The model is for co-simulation only.");
    return NULL;
}

DT_EXPORT void *FMI3(fmi3InstantiateScheduledExecution)(Text name, Text token, Text resources, bool visible,
                                                        bool logging, void *environment, LogMessage log,
                                                        void (*clock)(void *), void (*lock)(void), void (*unlock)(void))
{
    (void)name, (void)token, (void)resources, (void)visible, (void)logging, (void)clock, (void)lock, (void)unlock;
    if (log) log(environment, DT_ERROR, "logStatusError", "The model is for co-simulation only.");
    return NULL;
}

DT_EXPORT void *FMI3(fmi3InstantiateCoSimulation)(Text name, Text token, Text resources, bool visible, bool logging,
                                                  bool event_mode, bool early_return, const Reference required[],
                                                  size_t required_count, void *environment, LogMessage log,
                                                  void (*intermediate_update)(void))
{
    (void)resources, (void)visible, (void)logging, (void)early_return, (void)required, (void)intermediate_update;
    DtInstance *instance = dt_new(name);
    if (!instance) return NULL;
    instance->logger = (void (*)(void))log;
    instance->environment = environment;
    instance->log = write_log;
    const char *wrong = NULL;
    if (!token || strcmp(token, MODEL_TOKEN) != 0)
        wrong = "The instantiation token is not that of modelDescription.xml: library and description differ.";
    else if (event_mode || required_count)
        wrong = "The model has no event mode and no intermediate variables.";
    if (wrong) {
        dt_error(instance, wrong);
        dt_free(instance);
        return NULL;
    }
    return instance;
}

DT_EXPORT void FMI3(fmi3FreeInstance)(void *c) { dt_free(c); }

DT_EXPORT int FMI3(fmi3EnterInitializationMode)(void *c, bool tolerance_defined, double tolerance, double start,
                                                bool stop_defined, double stop)
{
    (void)tolerance_defined, (void)tolerance, (void)stop_defined, (void)stop;
    return dt_setup(c, start) == DT_OK ? dt_enter_initialisation(c) : DT_ERROR;
}

DT_EXPORT int FMI3(fmi3ExitInitializationMode)(void *c) { return dt_exit_initialisation(c); }

DT_EXPORT int FMI3(fmi3Terminate)(void *c) { return dt_terminate(c); }

DT_EXPORT int FMI3(fmi3Reset)(void *c)
{
    dt_reset(c);
    return DT_OK;
}

DT_EXPORT int FMI3(fmi3GetFloat64)(void *c, const Reference r[], size_t n, double v[], size_t values)
{
    return values == n ? dt_get(c, r, n, v) : dt_error(c, "Every variable is one number, but other counts were asked for.");
}

DT_EXPORT int FMI3(fmi3SetFloat64)(void *c, const Reference r[], size_t n, const double v[], size_t values)
{
    return values == n ? dt_set(c, r, n, v) : dt_error(c, "Every variable is one number, but other counts were given.");
}

/* There are no variables of other types; none of them may be asked for. */
#define OTHER_TYPE(get, set, type)                                                                                    \
    DT_EXPORT int FMI3(get)(void *c, const Reference r[], size_t n, type v[], size_t values)                          \
    {                                                                                                                 \
        (void)r, (void)v, (void)values;                                                                               \
        return n ? unknown(c) : DT_OK;                                                                                \
    }                                                                                                                 \
    DT_EXPORT int FMI3(set)(void *c, const Reference r[], size_t n, const type v[], size_t values)                    \
    {                                                                                                                 \
        (void)r, (void)v, (void)values;                                                                               \
        return n ? unknown(c) : DT_OK;                                                                                \
    }

OTHER_TYPE(fmi3GetFloat32, fmi3SetFloat32, float)
OTHER_TYPE(fmi3GetInt8, fmi3SetInt8, int8_t)
OTHER_TYPE(fmi3GetUInt8, fmi3SetUInt8, uint8_t)
OTHER_TYPE(fmi3GetInt16, fmi3SetInt16, int16_t)
OTHER_TYPE(fmi3GetUInt16, fmi3SetUInt16, uint16_t)
OTHER_TYPE(fmi3GetInt32, fmi3SetInt32, int32_t)
OTHER_TYPE(fmi3GetUInt32, fmi3SetUInt32, uint32_t)
OTHER_TYPE(fmi3GetInt64, fmi3SetInt64, int64_t)
OTHER_TYPE(fmi3GetUInt64, fmi3SetUInt64, uint64_t)
OTHER_TYPE(fmi3GetBoolean, fmi3SetBoolean, bool)
OTHER_TYPE(fmi3GetString, fmi3SetString, Text)

DT_EXPORT int FMI3(fmi3GetBinary)(void *c, const Reference r[], size_t n, size_t sizes[], Binary v[], size_t values)
{
    (void)r, (void)sizes, (void)v, (void)values;
    return n ? unknown(c) : DT_OK;
}

DT_EXPORT int FMI3(fmi3SetBinary)(void *c, const Reference r[], size_t n, const size_t sizes[], const Binary v[],
                                  size_t values)
{
    (void)r, (void)sizes, (void)v, (void)values;
    return n ? unknown(c) : DT_OK;
}

DT_EXPORT int FMI3(fmi3GetClock)(void *c, const Reference r[], size_t n, bool v[])
{
    (void)r, (void)v;
    return n ? unknown(c) : DT_OK;
}

DT_EXPORT int FMI3(fmi3SetClock)(void *c, const Reference r[], size_t n, const bool v[])
{
    (void)r, (void)v;
    return n ? unknown(c) : DT_OK;
}

DT_EXPORT int FMI3(fmi3GetFMUState)(void *c, void **state) { return dt_get_state(c, state); }

DT_EXPORT int FMI3(fmi3SetFMUState)(void *c, void *state) { return dt_set_state(c, state); }

DT_EXPORT int FMI3(fmi3FreeFMUState)(void *c, void **state)
{
    (void)c;
    return dt_free_state(state);
}

DT_EXPORT int FMI3(fmi3SerializedFMUStateSize)(void *c, void *state, size_t *size)
{
    (void)c, (void)state;
    *size = sizeof(DtSerialised);
    return DT_OK;
}

DT_EXPORT int FMI3(fmi3SerializeFMUState)(void *c, void *state, uint8_t bytes[], size_t size)
{
    return dt_serialise(c, state, bytes, size);
}

DT_EXPORT int FMI3(fmi3DeserializeFMUState)(void *c, const uint8_t bytes[], size_t size, void **state)
{
    return dt_deserialise(c, bytes, size, state);
}

DT_EXPORT int FMI3(fmi3DoStep)(void *c, double time, double length, bool no_set_state, bool *event_needed,
                               bool *terminate, bool *early_return, double *last_time)
{
    (void)no_set_state;
    int status = dt_step(c, time, length);
    if (event_needed) *event_needed = false;
    if (terminate) *terminate = false;
    if (early_return) *early_return = false;
    if (last_time) *last_time = dt_time(&((DtInstance *)c)->memory);
    return status;
}

/* What only model exchange, event mode, clocks or derivatives need: an error, as modelDescription.xml offers none. */
#define NOT_OFFERED(name, ...)                                                                                        \
    DT_EXPORT int FMI3(name)(void *c, __VA_ARGS__) { return unknown(c); }
#define NOT_OFFERED_ALONE(name)                                                                                       \
    DT_EXPORT int FMI3(name)(void *c) { return unknown(c); }

#if defined(__GNUC__)
#pragma GCC diagnostic ignored "-Wunused-parameter"
#endif

NOT_OFFERED_ALONE(fmi3EnterEventMode)
NOT_OFFERED_ALONE(fmi3EnterStepMode)
NOT_OFFERED_ALONE(fmi3EnterConfigurationMode)
NOT_OFFERED_ALONE(fmi3ExitConfigurationMode)
NOT_OFFERED_ALONE(fmi3EnterContinuousTimeMode)
NOT_OFFERED_ALONE(fmi3EvaluateDiscreteStates)
NOT_OFFERED(fmi3UpdateDiscreteStates, bool *a, bool *b, bool *d, bool *e, bool *f, double *g)
NOT_OFFERED(fmi3GetNumberOfVariableDependencies, Reference r, size_t *n)
NOT_OFFERED(fmi3GetVariableDependencies, Reference r, size_t a[], Reference b[], size_t d[], int e[], size_t n)
NOT_OFFERED(fmi3GetDirectionalDerivative, const Reference a[], size_t n, const Reference b[], size_t m, const double d[],
            size_t k, double e[], size_t l)
NOT_OFFERED(fmi3GetAdjointDerivative, const Reference a[], size_t n, const Reference b[], size_t m, const double d[],
            size_t k, double e[], size_t l)
NOT_OFFERED(fmi3GetOutputDerivatives, const Reference r[], size_t n, const int32_t order[], double v[], size_t values)
NOT_OFFERED(fmi3GetIntervalDecimal, const Reference r[], size_t n, double v[], int q[])
NOT_OFFERED(fmi3GetIntervalFraction, const Reference r[], size_t n, uint64_t a[], uint64_t b[], int q[])
NOT_OFFERED(fmi3GetShiftDecimal, const Reference r[], size_t n, double v[])
NOT_OFFERED(fmi3GetShiftFraction, const Reference r[], size_t n, uint64_t a[], uint64_t b[])
NOT_OFFERED(fmi3SetIntervalDecimal, const Reference r[], size_t n, const double v[])
NOT_OFFERED(fmi3SetIntervalFraction, const Reference r[], size_t n, const uint64_t a[], const uint64_t b[])
NOT_OFFERED(fmi3SetShiftDecimal, const Reference r[], size_t n, const double v[])
NOT_OFFERED(fmi3SetShiftFraction, const Reference r[], size_t n, const uint64_t a[], const uint64_t b[])
NOT_OFFERED(fmi3CompletedIntegratorStep, bool a, bool *b, bool *d)
NOT_OFFERED(fmi3SetTime, double time)
NOT_OFFERED(fmi3SetContinuousStates, const double x[], size_t n)
NOT_OFFERED(fmi3GetContinuousStateDerivatives, double x[], size_t n)
NOT_OFFERED(fmi3GetContinuousStates, double x[], size_t n)
NOT_OFFERED(fmi3GetNominalsOfContinuousStates, double x[], size_t n)
NOT_OFFERED(fmi3GetEventIndicators, double x[], size_t n)
NOT_OFFERED(fmi3GetNumberOfEventIndicators, size_t *n)
NOT_OFFERED(fmi3GetNumberOfContinuousStates, size_t *n)
NOT_OFFERED(fmi3ActivateModelPartition, Reference clock, double time)
