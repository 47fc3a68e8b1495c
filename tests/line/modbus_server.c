/* A small Modbus server on libmodbus, for tests: `modbus_server tcp` or `modbus_server rtu PATH`.
 *
 * It holds the words of an Altivar 71 at address 2 that the tests read, and the coils and inputs of
 * tests/drive/coils.toml. It says where it serves, and answers until it is ended. */
#include <arpa/inet.h>
#include <errno.h>
#include <modbus.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

enum { DEVICE = 2, WORDS = 16384, COILS = 32 };

static void fail(const char *what)
{
    fprintf(stderr, "%s: %s\n", what, modbus_strerror(errno));
    exit(1);
}

static modbus_mapping_t *words(void)
{
    modbus_mapping_t *map = modbus_mapping_new(COILS, COILS, WORDS, 0);
    if (map == NULL)
        fail("words");
    map->tab_registers[3201] = 0x0637;
    map->tab_registers[3202] = 425;
    map->tab_registers[9001] = 57;
    map->tab_registers[9020] = 1; /* ramps count tenths of a second */
    map->tab_input_bits[0] = map->tab_input_bits[2] = 1;
    map->tab_bits[1] = map->tab_bits[2] = 1; /* a command that runs a motor in reverse */
    return map;
}

static void answer(modbus_t *bus, modbus_mapping_t *map)
{
    uint8_t query[MODBUS_TCP_MAX_ADU_LENGTH];
    for (;;) {
        int length = modbus_receive(bus, query);
        if (length > 0)
            modbus_reply(bus, query, length, map);
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
    printf("ready on tcp:127.0.0.1:%d\n", ntohs(here.sin_port));
    fflush(stdout);
    for (;;) {
        if (modbus_tcp_accept(bus, &listener) < 0)
            fail("accept");
        answer(bus, map);
        modbus_close(bus);
    }
}

static void serve_rtu(modbus_mapping_t *map, const char *path)
{
    modbus_t *bus = modbus_new_rtu(path, 19200, 'N', 8, 1);
    if (bus == NULL || modbus_set_slave(bus, DEVICE) < 0 || modbus_connect(bus) < 0)
        fail(path);
    printf("ready on serial:%s\n", path);
    fflush(stdout);
    answer(bus, map);
}

int main(int count, char **arguments)
{
    if (count == 2 && strcmp(arguments[1], "tcp") == 0)
        serve_tcp(words());
    else if (count == 3 && strcmp(arguments[1], "rtu") == 0)
        serve_rtu(words(), arguments[2]);
    else
        fprintf(stderr, "usage: modbus_server tcp | rtu PATH\n");
    return 1;
}
