// A Modbus TCP server on modbus-serial, for tests. Holds the words of a drive at address 2; the port is its argument.
const { ServerTCP } = require("modbus-serial");

const words = new Map([[3201, 0x0637], [3202, 425], [9001, 57], [9020, 1]]);
const drive = {
  getHoldingRegister(address, _device, done) {
    if (words.has(address)) done(null, words.get(address));
    else done({ modbusErrorCode: 2 });
  },
};
const server = new ServerTCP(drive, { host: "127.0.0.1", port: Number(process.argv[2]), unitID: 2 });
const announce = () => console.log(`ready on tcp:127.0.0.1:${server._server.address().port}`);
if (server._server.listening) announce();
else server._server.on("listening", announce);
