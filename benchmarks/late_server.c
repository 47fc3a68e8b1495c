/* A Modbus server on libmodbus that answers late on purpose, for the soak.
 *
 *     late_server tcp EVERY LATE
 *     late_server rtu PATH DEVICE EVERY LATE
 *
 * Every EVERYth answer is late, by 1/4, 2/4, 3/4 or all of LATE ms in turn, and every third of
 * those is sent twice. Words come in first, a line "DEVICE ADDRESS WORD" each, up to a line ".".
 * Says where it serves; at SIGTERM says how many answers it gave, how many late and twice. */
#include <arpa/inet.h>
#include <errno.h>
#include <modbus.h>
#include <signal.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

enum { DEVICES = 256, WORDS = 65536, LOOK_US = 100000 };

static volatile sig_atomic_t ended;
static uint16_t *tables[DEVICES];
static unsigned long answers, late, twice;
static unsigned long every, longest_ms;

static void end(int number)
{
    (void)number;
    ended = 1;
}

static void fail(const char *what)
{
    fprintf(stderr, "%s: %s\n", what, modbus_strerror(errno));
    exit(1);
}

static void take_words(void)
{
    unsigned device, address, word;
    while (scanf("%u %u %u", &device, &address, &word) == 3) {
        if (device >= DEVICES || address >= WORDS)
            continue;
        if (tables[device] == NULL)
            tables[device] = calloc(WORDS, sizeof(uint16_t));
        if (tables[device] == NULL)
            fail("words");
        tables[device][address] = (uint16_t)word;
    }
}

/* The answer to one request, maybe late, maybe twice. */
static void reply(modbus_t *bus, modbus_mapping_t *map, const uint8_t *query, int length)
{
    unsigned device = query[modbus_get_header_length(bus) - 1];
    if (tables[device] == NULL)
        return;
    map->tab_registers = tables[device];
    answers++;
    if (answers % every == 0) {
        usleep((useconds_t)(1000 * longest_ms * (1 + late % 4) / 4));
        late++;
        if (late % 3 == 0) {
            modbus_reply(bus, query, length, map);
            twice++;
        }
    }
    modbus_reply(bus, query, length, map);
}

static void answer(modbus_t *bus, modbus_mapping_t *map)
{
    uint8_t query[MODBUS_TCP_MAX_ADU_LENGTH];
    modbus_set_indication_timeout(bus, 0, LOOK_US); /* to look for the end now and then */
    while (!ended) {
        int length = modbus_receive(bus, query);
        if (length > 0)
            reply(bus, map, query, length);
        else if (length == -1 && errno == ECONNRESET)
            return;
    }
}

static void serve_tcp(modbus_mapping_t *map)
{
    modbus_t *bus = modbus_new_tcp("127.0.0.1", 0);
    int listener = bus ? modbus_tcp_listen(bus, 1) : -1;
    struct sockaddr_in here;
    socklen_t size = sizeof here;
    if (listener < 0 || getsockname(listener, (struct sockaddr *)&here, &size) < 0)
        fail("listen");
    printf("tcp:127.0.0.1:%d\n", ntohs(here.sin_port));
    fflush(stdout);
    while (!ended) {
        if (modbus_tcp_accept(bus, &listener) < 0) {
            if (ended)
                return;
            fail("accept");
        }
        answer(bus, map);
        modbus_close(bus);
    }
}

static void serve_rtu(modbus_mapping_t *map, const char *path, int device)
{
    modbus_t *bus = modbus_new_rtu(path, 19200, 'N', 8, 1);
    if (bus == NULL || modbus_set_slave(bus, device) < 0 || modbus_connect(bus) < 0)
        fail(path);
    printf("%s\n", path);
    fflush(stdout);
    answer(bus, map);
}

int main(int count, char **arguments)
{
    struct sigaction action = {.sa_handler = end};
    modbus_mapping_t *map = modbus_mapping_new(0, 0, WORDS, 0);
    int tcp = count == 4 && strcmp(arguments[1], "tcp") == 0;
    int rtu = count == 6 && strcmp(arguments[1], "rtu") == 0;
    if (!tcp && !rtu) {
        fprintf(stderr, "usage: late_server tcp EVERY LATE | rtu PATH DEVICE EVERY LATE\n");
        return 2;
    }
    if (map == NULL)
        fail("words");
    every = strtoul(arguments[count - 2], NULL, 10);
    longest_ms = strtoul(arguments[count - 1], NULL, 10);
    if (every == 0)
        every = 1;
    sigaction(SIGTERM, &action, NULL);
    take_words();
    if (tcp)
        serve_tcp(map);
    else
        serve_rtu(map, arguments[2], atoi(arguments[3]));
    printf("%lu %lu %lu\n", answers, late, twice);
    return 0;
}
